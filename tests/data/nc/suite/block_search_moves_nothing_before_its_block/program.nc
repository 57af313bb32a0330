N10 G01 X100 F6000
N20 M5
N30 #MSG SYN ["not sent"]
N40 G04 X5
N50 P1 = 3
N60 #MSG ["decoded: %d", P1]
N70 Y50
(by rapid motion to X100 Y50, 111.803 mm at 166.667 mm/s: 0.671 s; then 10 mm at 100 mm/s)
N80 X110 M7
N90 #MSG SYN ["there"]
M30
