N10 #MSG ["before"]
N20 SSD[SD.COUNT = 1]
N30 #MSG ["decoded"]
N40 M30
