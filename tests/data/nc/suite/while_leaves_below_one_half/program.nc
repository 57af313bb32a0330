P1 = 2
$WHILE P1
  #MSG ["%.1f", P1]
  P1 -= 0.5
$ENDWHILE
#MSG ["left at %.1f", P1]
P1 = -2
$WHILE P1
  #MSG ["%.1f", P1]
  P1 += 0.5
$ENDWHILE
M30
