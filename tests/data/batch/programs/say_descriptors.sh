#!/bin/sh
# The open descriptors of this shell, without the one that ls opens for the folder.
ls /proc/$$/fd | tr '\n' ' '
