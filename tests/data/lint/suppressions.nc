%suppressions
V.G.SERVICE.UUID = "560AACBF-6335-44a9-895A-8B27F3ED5E47"
; millrace-lint: off-file answer-not-checked
V.G.SERVICE.REQUEST_STATE = 1
G01 X1 F100
; millrace-lint: off wait-without-flush, wait-without-timeout
#WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0
V.P.A = V.G.SERVICE.RESPONSE
V.G.SERVICE.REQUEST_STATE = 2
G01 X2
#WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0 (millrace-lint: off wait-without-flush)
M30 (millrace-lint: off no-such-rule)
(millrace-lint: on syntax)
