%SysServiceWait
; Waits until a service has answered: until V.G.SERVICE.RESPONSE_STATE is not @P1.
;
;   L CYCLE [NAME="SysServiceWait.cyc", @P1=<state to go on waiting at, 0 if left out>,
;            @P2=<milliseconds to wait at most>, @P3=<timer for that, 0 to 127>]
;
; @P2 and @P3 may be left out together: then it waits for ever. If the time runs out it returns
; without an error, and RESPONSE_STATE still is @P1 (our choice; the vendor does not say).
#VAR
  V.L.WAITING = 0
#ENDVAR
$IF EXIST[@P1]
  V.L.WAITING = @P1
$ENDIF
#FLUSH CONTINUE ; no motion block may be withheld while the program waits
$IF EXIST[@P2]
  #TIMER CLEAR [ID=@P3]
  #TIMER START [ID=@P3]
  $WHILE V.G.SERVICE.RESPONSE_STATE == V.L.WAITING
    #TIMER READ [ID=@P3]
    $IF V.G.TIMER[@P3] >= @P2
      $BREAK
    $ENDIF
  $ENDWHILE
  #TIMER STOP [ID=@P3]
$ELSE
  #WAIT FOR V.G.SERVICE.RESPONSE_STATE != V.L.WAITING
$ENDIF
M17
