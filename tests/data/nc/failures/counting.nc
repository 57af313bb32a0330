%counting
(Three calls; the answer to each must be its own number. An interim state releases nothing.)
N10 V.G.SERVICE.UUID = "c0ffee00-0000-4000-8000-000000000001"
N20 P1 = 1
N30 $WHILE P1 <= 3
N40   V.G.SERVICE.REQUEST = INT_TO_STR[P1]
N50   V.G.SERVICE.REQUEST_STATE = P1
N60   #FLUSH CONTINUE
N70   #WAIT FOR V.G.SERVICE.RESPONSE_STATE == 1
N80   $IF V.G.SERVICE.RESPONSE != INT_TO_STR[P1]
N90     #MSG ["call %d: wrong answer %s", P1, V.G.SERVICE.RESPONSE]
N100  $ENDIF
N110  P1 = P1 + 1
N120 $ENDWHILE
N130 #MSG ["%d calls answered", P1 - 1]
N140 M30
