; A warning that the program goes on after
N10 $FOR P1 = 1, 2, 0
N20   $BREAK
N30 $ENDFOR
N40 M30
