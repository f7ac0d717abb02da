#!/bin/sh
# Stands in for Python: $ANSWERS, the arms of a shell `case`, say what it does.
eval "case \$1 in $ANSWERS esac"
