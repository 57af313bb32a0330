P1 = 0
$WHILE TRUE
  $FOR P2 = 1, 10, 1
    P1 += 1
    $IF P1 == 4 $GOTO [OUT]
  $ENDFOR
$ENDWHILE
[OUT] #MSG ["%d", P1]
M30
