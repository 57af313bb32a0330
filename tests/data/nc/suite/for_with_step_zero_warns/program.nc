P2 = 0
N10 $FOR P1 = 1, 3, 0
  P2 += 1
  $IF P2 == 5
    $BREAK
  $ENDIF
$ENDFOR
#MSG ["%d passes", P2]
M30
