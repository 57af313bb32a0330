(the centre is 0.1 mm off, and moves to where an arc is possible)
N10 G02 X10 I5.1 F600
N20 #MSG SYN ["round"]
(without correction the radii may differ by 5 um)
N30 G164 G03 X0 I-5.002
N40 #MSG SYN ["back"]
M30
