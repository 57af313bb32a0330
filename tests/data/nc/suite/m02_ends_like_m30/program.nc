#MSG ["one"]
M02
#MSG ["never"]
