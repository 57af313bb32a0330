N10 #MSG ["café"]
N20 M30
