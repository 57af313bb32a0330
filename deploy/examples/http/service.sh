#!/bin/sh
# A service over HTTP in a shell, with socat and awk: answers a number with its square root.
#
#   service.sh [PORT]
if [ "$1" != --answer ]; then
  exec socat "TCP-LISTEN:${1:-8000},bind=127.0.0.1,reuseaddr,fork" "EXEC:$0 --answer"
fi
length=0
while read -r line && [ "$line" != "$(printf '\r')" ]; do
  case $line in
    [Cc]ontent-[Ll]ength:*) length=$(printf '%s' "${line#*:}" | tr -dc 0-9) ;;
  esac
done
number=$(head -c "$length" | sed 's/.*"text": *"\([0-9.]*\)".*/\1/')
body=$(awk -v n="$number" 'BEGIN { printf "%.6f", sqrt(n) }')
printf 'HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nContent-Length: %d\r\nConnection: close\r\n\r\n%s' "${#body}" "$body"
