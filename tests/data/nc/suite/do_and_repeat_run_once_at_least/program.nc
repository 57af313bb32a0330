P1 = 0
$DO
  #MSG ["do %d", P1]
  P1 = P1 + 1
$ENDDO P1 < 3
$REPEAT
  #MSG ["repeat %d", P1]
  P1 = P1 - 1
$UNTIL P1 < 2
$DO
  #MSG ["once"]
$ENDDO FALSE
$REPEAT
  #MSG ["once"]
$UNTIL TRUE
M30
