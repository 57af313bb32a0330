%archiving
(Has each of its numbers kept. An answer of another state than 1 says that it is not.)
N10 V.G.SERVICE.UUID = "@UUID@"
N20 P1 = 1
N30 $WHILE P1 <= @CALLS@
N40   V.G.SERVICE.REQUEST = "PUT number=" + INT_TO_STR[P1]
N50   V.G.SERVICE.REQUEST_STATE = P1
N60   #FLUSH CONTINUE
N70   #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0
N80   $IF V.G.SERVICE.RESPONSE_STATE != 1
N90     #MSG ["call %d: wrong answer %s", P1, V.G.SERVICE.RESPONSE]
N100  $ENDIF
N105  #MSG ["number %d", P1]
N110  P1 = P1 + 1
N120 $ENDWHILE
N130 #MSG ["%d calls answered", P1 - 1]
N140 M30
