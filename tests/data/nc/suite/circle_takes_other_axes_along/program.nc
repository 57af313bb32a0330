(a screw: 15.708 mm round and 10 mm up are 18.621 mm)
N10 G02 X10 Z10 I5 F600
N20 #MSG SYN ["Z%.1f", V.A.ABS.Z]
M30
