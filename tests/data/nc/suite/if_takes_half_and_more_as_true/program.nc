$FOR P1 = -0.75, 0.75, 0.25
  $IF P1
    #MSG ["%.2f is true", P1]
  $ELSE
    #MSG ["%.2f is false", P1]
  $ENDIF
$ENDFOR
M30
