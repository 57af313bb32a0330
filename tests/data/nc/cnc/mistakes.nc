N10 $IF 1 > 0
N20 #MSG ["%d"]
N30 M30
