N20 #MSG ["last"]
M30
