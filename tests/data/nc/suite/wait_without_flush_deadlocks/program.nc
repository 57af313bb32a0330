(The last motion block is withheld, so nothing can cause what the program waits for.)
N10 G01 X100 F6000
N20 #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0
N30 #MSG ["never"]
N40 M30
