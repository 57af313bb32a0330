(10 mm/s: a half circle of radius 5 takes 1.571 s)
N10 G17 G02 X10 I5 F600
N20 #MSG SYN ["X%.3f Y%.3f", V.A.ABS.X, V.A.ABS.Y]
N30 G03 X0 I-5
N40 #MSG SYN ["back"]
N50 G02 I5
N60 #MSG SYN ["a full circle"]
N70 G03 X5 Y5 I5
N80 #MSG SYN ["three quarters"]
M30
