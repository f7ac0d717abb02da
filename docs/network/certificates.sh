#!/bin/sh
# Certificates to try TLS with, in the present folder: sh certificates.sh ROBOT, where ROBOT is
# the name or the address by which the others reach the robot. Needs openssl.
set -eu
robot=${1:-localhost}
case $robot in
*[!0-9.]*) name=DNS:$robot ;;
*) name=IP:$robot ;;
esac
new() {
    openssl req -new -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes "$@" 2>/dev/null
}
new -x509 -days 365 -subj "/CN=ours" -keyout ours.key -out ours.pem
for side in robot policy; do
    new -subj "/CN=$side" -keyout "$side.key" -out "$side.csr"
    printf 'subjectAltName=%s\n' "$name" >"$side.ext"
    openssl x509 -req -in "$side.csr" -CA ours.pem -CAkey ours.key -CAcreateserial \
        -days 365 -extfile "$side.ext" -out "$side.pem" 2>/dev/null
    rm "$side.csr" "$side.ext"
done
