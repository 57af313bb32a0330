#MSG ["after the reset"]
M30
