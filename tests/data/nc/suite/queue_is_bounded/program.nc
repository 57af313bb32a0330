$FOR P1 = 1, 10, 1
  G01 XP1 F60
  #MSG ["decoded %d", P1]
$ENDFOR
M30
