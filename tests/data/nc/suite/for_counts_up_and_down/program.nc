$FOR P1 = 1, 3, 1
  #MSG ["up %d", P1]
$ENDFOR
$FOR V.P.I = 3, 1, -1
  #MSG ["down %d", V.P.I]
$ENDFOR
$FOR P1 = 5, 1, 1
  #MSG ["never"]
$ENDFOR
$FOR P1 = 0, 1, 0.4
  #MSG ["%.1f", P1]
$ENDFOR
#MSG ["P1 is %.1f behind the loop", P1]
M30
