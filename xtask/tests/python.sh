#!/bin/sh
# Stands in for Python: $ANSWERS contains the arms of a shell `case` with its behaviour.
eval "case \$1 in $ANSWERS esac"
