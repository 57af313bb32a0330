#!/bin/sh
# The argument and standard input, each between brackets.
read -r line
printf '[%s] [%s]\n' "$1" "$line"
