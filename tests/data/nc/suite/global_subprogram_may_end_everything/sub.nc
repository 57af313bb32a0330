#MSG ["sub"]
M30
