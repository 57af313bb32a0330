N10 #MSG ["first"]
