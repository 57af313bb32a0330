#MSG SAVE ["with time %d", 1]
#MSG SAVE EXCLUSIVE ["without"]
#MSG SAVE CONTINUE ["no line end"]
#MSG SAVE EXCLUSIVE CONTINUE ["neither"]
#FILE NAME [MSG="report.txt"]
#MSG SAVE ["elsewhere"]
#FILENAME [MSG="old style.txt"]
#MSG SAVE ["elsewhere"]
M30
