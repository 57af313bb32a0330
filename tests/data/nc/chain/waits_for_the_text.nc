%waits_for_the_text
(A hundred calls of a service whose programs wait for a text in RESPONSE and look at no state.)
(RESPONSE is emptied last before the request; the next one follows at once.)
N10 V.G.SERVICE.UUID = "c0ffee00-0000-4000-8000-000000000001"
N20 P1 = 1
N30 $WHILE P1 <= 100
N40   V.G.SERVICE.REQUEST = INT_TO_STR[P1]
N50   V.G.SERVICE.RESPONSE = ""
N60   V.G.SERVICE.REQUEST_STATE = 1
N70   #FLUSH WAIT
N80   #WAIT FOR LEN[V.G.SERVICE.RESPONSE] > 0
N90   $IF V.G.SERVICE.RESPONSE != INT_TO_STR[P1]
N100    #MSG ["call %d: wrong answer %s", P1, V.G.SERVICE.RESPONSE]
N110  $ENDIF
N120  P1 = P1 + 1
N130 $ENDWHILE
N140 #MSG ["%d calls answered, state %u", P1 - 1, V.G.SERVICE.RESPONSE_STATE]
N150 M30
