P1 = 0
$WHILE P1 < 4
  $IF P1 == 0
    #MSG ["zero"]
  $ELSEIF P1 == 1
    #MSG ["one"]
  $ELSEIF P1 == 2
    #MSG ["two"]
  $ELSE
    #MSG ["many: %d", P1]
  $ENDIF
  P1 += 1
$ENDWHILE
M30
