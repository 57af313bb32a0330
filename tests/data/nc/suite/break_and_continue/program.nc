$FOR P1 = 1, 10, 1
  $IF P1 == 2
    $CONTINUE
  $ENDIF
  $IF P1 == 5
    $BREAK
  $ENDIF
  #MSG ["for %d", P1]
$ENDFOR
P1 = 0
$WHILE TRUE
  P1 += 1
  $SWITCH P1
  $CASE 1
    $CONTINUE
  $CASE 3
    $BREAK (leaves the $SWITCH only)
  $ENDSWITCH
  #MSG ["while %d", P1]
  $IF P1 >= 3
    $BREAK
  $ENDIF
$ENDWHILE
P1 = 0
$REPEAT
  P1 += 1
  $CONTINUE (goes to the condition)
$UNTIL P1 == 3
$DO
  P1 += 1
  $CONTINUE
$ENDDO P1 < 6
#MSG ["end %d", P1]
M30
