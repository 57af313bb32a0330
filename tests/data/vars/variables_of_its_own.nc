; Variables of a program, of several types, for those who list and read them.
#VAR
  V.P.TABLE[2] : SGN16 = [7, -8]
  V.P.TEXT : STRING[20] = "part"
#ENDVAR
P12 = 3.5
#MSG ["waits"]
#WAIT FOR FALSE
M30
