%square_root
(Asks the square root service for the root of 3 while the machine goes on.)
N10 G00 X0 Y0
N20 G01 X100 F6000
N30 V.G.SERVICE.UUID = "560AACBF-6335-44a9-895A-8B27F3ED5E47"
N40 V.G.SERVICE.REQUEST = "3"
N50 V.G.SERVICE.REQUEST_STATE = 1
N60 #FLUSH CONTINUE ; N20 runs on while the program waits for the answer
N70 #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0
N80 $IF V.G.SERVICE.RESPONSE_STATE == 1
N90   #MSG ["response = %s", V.G.SERVICE.RESPONSE]
N100  #MSG SAVE EXCLUSIVE ["root of 3: %s", V.G.SERVICE.RESPONSE]
N110 $ELSE
N120  #MSG ["the service reports state %d: %s", V.G.SERVICE.RESPONSE_STATE, \
            V.G.SERVICE.RESPONSE]
N130 $ENDIF
N140 G01 X0
N150 M30
