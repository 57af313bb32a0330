%polling_loop
V.G.SERVICE.UUID = "560AACBF-6335-44a9-895A-8B27F3ED5E47"
(The loop is left when the answer is there; it stands in another one.)
P1 = 1
$WHILE P1 <= 3
  G01 X[P1] F1000
  V.G.SERVICE.REQUEST_STATE = P1
  $WHILE V.G.SERVICE.RESPONSE_STATE == 0
    P2 = P2 + 1
  $ENDWHILE
  V.P.A = V.G.SERVICE.RESPONSE
  P1 = P1 + 1
$ENDWHILE
M30
