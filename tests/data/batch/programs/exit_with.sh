#!/bin/sh
# exit_with.sh CODE [TEXT]: the request is "CODE TEXT".
code=${1%% *}
text=${1#"$code"}
printf '%s' "${text# }"
exit "$code"
