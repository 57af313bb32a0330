P1 = 0
N10: P1 += 1
$IF P1 < 3 $GOTO N10
#MSG ["%d rounds", P1]
$GOTO [BEHIND]
#MSG ["never"]
[BEHIND] #MSG ["behind"]
P2 = 90
$IF P1 == 3 $GOTO N[P2 + 10]
#MSG ["never"]
N100: #MSG ["at 100"]
N110 #MSG ["last action"] 
N120 P3 = 1 $GOTO N140
#MSG ["never"]
N140: M30
