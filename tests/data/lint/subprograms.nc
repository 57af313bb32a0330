%subprograms
V.G.SERVICE.REQUEST_STATE = 1
L ask_and_wait.sub
V.P.A = V.G.SERVICE.RESPONSE
L somewhere_else.sub
#WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0
M30
