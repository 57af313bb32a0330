%square_root_of_3
(Asks the square root service for one number while the axis moves.)
N10 G00 X0
N20 G01 X20 F3000
N30 V.G.SERVICE.UUID = "560AACBF-6335-44a9-895A-8B27F3ED5E47"
N40 V.G.SERVICE.REQUEST = "3"
N50 V.G.SERVICE.REQUEST_STATE = 1 (the request is out from here on)
N60 #FLUSH CONTINUE (without it the withheld motion could wait for this wait)
N70 #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0
N80 $IF V.G.SERVICE.RESPONSE_STATE == 1
N90   #MSG ["response = %s", V.G.SERVICE.RESPONSE]
N100 $ELSE
N110   #MSG ["error %u: %s", V.G.SERVICE.RESPONSE_STATE, V.G.SERVICE.RESPONSE]
N120 $ENDIF
N130 M30
