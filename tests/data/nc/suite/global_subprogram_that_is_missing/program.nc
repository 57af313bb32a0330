N10 #MSG ["one"]
N20 L nowhere.nc
M30
