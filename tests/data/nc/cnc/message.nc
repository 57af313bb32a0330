N10 #MSG ["hello %d", 7]
N20 #MSG SAVE ["saved"]
N30 #MSG SAVE EXCLUSIVE ["plain"]
N40 M30
