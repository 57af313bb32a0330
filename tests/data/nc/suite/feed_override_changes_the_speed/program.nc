N10 G01 X100 F6000
N20 #MSG SYN ["there"]
N30 G04 0.5
N40 #MSG SYN ["dwells are not faster"]
M30
