$FOR P1 = 0, 4, 1
  $SWITCH P1 + 0.0005
  $CASE 1
    #MSG ["one"]
    $BREAK
  $CASE 2
    #MSG ["two"]
  $CASE 3
    #MSG ["two or three"]
    $BREAK
  $DEFAULT
    #MSG ["else %d", P1]
  $ENDSWITCH
$ENDFOR
$SWITCH 99
$CASE 1
  #MSG ["never"]
$ENDSWITCH
M30
