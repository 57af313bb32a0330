%comments
(A comment (with another one (inside)) and more) #MSG ["one"] ; the rest
; #MSG ["never"]
#MSG ["two"] (not closed, so it ends here #MSG ["never"]
#COMMENT BEGIN
#MSG ["never"]
( this bracket stays open
N7 #COMMENT END
N10 #MSG ["(no comment; in quotes)"]
M30
