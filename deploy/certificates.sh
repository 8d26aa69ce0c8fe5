#!/usr/bin/env bash
# A site's own certificate authority, and a certificate for each machine, service and person.
#
#   certificates.sh ca FOLDER [--days N] [--name TEXT]       the authority, once
#   certificates.sh issue FOLDER NAME [--days N]             a client, by its name in access.yaml
#   certificates.sh router FOLDER NAME ADDRESS... [--days N] a router, with its host names and IPs
#   certificates.sh renew FOLDER NAME [--days N]             a new key and certificate, same name
#   certificates.sh list FOLDER                              names and when they end
#
# FOLDER/ca holds the authority: keep it on a host that is not on the machines' network.
# FOLDER/NAME holds what NAME's host needs and nothing else: ca.crt, tls.crt, tls.key.
# Folders are 0700 and keys 0600. Nothing is overwritten but by `renew`, whose files appear whole.
# Zenoh reads no revocation lists: who is to be kept out is taken from access.yaml (and the router
# started anew), and certificates live briefly: 90 days, the authority 3650. None outlives the
# authority: its days are cut, with a word.
set -euo pipefail
umask 077

fail() {
  local text="$*"
  echo "certificates.sh: ${text//[[:cntrl:]]/ }" >&2
  exit 2
}

usage() {
  sed -n '4,8s/^# *//p' "$0" >&2
  exit 2
}

# options ARGUMENT...: sets days, name and words.
options() {
  days='' name='' words=()
  while [ $# -gt 0 ]; do
    case $1 in
      --days | --name)
        [ $# -ge 2 ] || fail "$1 needs a value"
        if [ "$1" = --days ]; then days=$2; else name=$2; fi
        shift
        ;;
      -*) fail "$1 is no option; there are --days N and --name TEXT" ;;
      *) words+=("$1") ;;
    esac
    shift
  done
  [[ -z $days || $days =~ ^[1-9][0-9]{0,4}$ ]] || fail "--days $days: a number from 1 to 99999"
  [[ $name =~ ^[[:alnum:]\ ._-]{0,64}$ ]] || fail "--name: up to 64 letters, digits, space . _ -"
}

valid_name() {
  [[ $1 =~ ^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$ ]] ||
    fail "'$1' is no name: up to 64 of A-Z a-z 0-9 . _ - that begin with a letter or digit"
  [ "$1" != ca ] || fail "the name 'ca' is the authority's own"
}

# An address of version 4 has four parts up to 255; what else looks like one is no host name either.
is_ipv4() {
  local part parts
  [[ $1 =~ ^[0-9]{1,3}(\.[0-9]{1,3}){3}$ ]] || return 1
  IFS=. read -ra parts <<<"$1"
  for part in "${parts[@]}"; do
    [ "$((10#$part))" -le 255 ] || return 1
  done
}

is_ipv6() {
  local groups=${1//[^:]/}
  [[ $1 =~ ^([0-9A-Fa-f]{0,4}:){2,7}[0-9A-Fa-f]{0,4}$ && $1 != *:::* && ! $1 =~ ::.*:: ]] || return 1
  [[ $1 =~ ^(::|[0-9A-Fa-f]) && $1 =~ (::|[0-9A-Fa-f])$ ]] || return 1
  [[ $1 == *::* || ${#groups} -eq 7 ]]
}

alternative_names() {
  local address list=''
  for address in "$@"; do
    if is_ipv4 "$address" || is_ipv6 "$address"; then
      list+=",IP:$address"
    elif [[ $address =~ ^[0-9.:]+$ ]]; then
      fail "'$address' is no IP address"
    elif [[ $address =~ ^[A-Za-z0-9]([A-Za-z0-9.-]{0,251}[A-Za-z0-9])?$ && $address != *..* ]]; then
      list+=",DNS:$address"
    else
      fail "'$address' is neither a host name nor an IP address"
    fi
  done
  echo "${list#,}"
}

new_key() {
  openssl genpkey -quiet -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1" 2>/dev/null ||
    openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1"
}

make_authority() {
  local folder=$1 lifetime=${2:-3650} common=${3:-rampe-guard site}
  [ ! -e "$folder/ca" ] || fail "$folder/ca exists already; it is never overwritten"
  mkdir -p "$folder"
  local work
  work=$(mktemp -d "$folder/.new.XXXXXX")
  trap 'rm -rf "$work"' EXIT
  new_key "$work/ca.key"
  printf '%s\n' '[req]' 'distinguished_name = dn' 'x509_extensions = ext' 'prompt = no' \
    '[dn]' "CN = $common" '[ext]' 'basicConstraints = critical, CA:TRUE, pathlen:0' \
    'keyUsage = critical, keyCertSign, cRLSign' 'subjectKeyIdentifier = hash' >"$work/ca.cnf"
  openssl req -x509 -new -sha256 -key "$work/ca.key" -config "$work/ca.cnf" \
    -days "$lifetime" -out "$work/ca.crt"
  rm "$work/ca.cnf"
  mv -T "$work" "$folder/ca"
  trap - EXIT
  echo "$folder/ca: the authority '$common', for $lifetime days"
}

# days_left FOLDER DAYS: so many, or as many as the authority has left.
days_left() {
  local end left
  end=$(openssl x509 -in "$1/ca/ca.crt" -noout -enddate | cut -d= -f2)
  left=$((($(date -d "$end" +%s) - $(date +%s) - 60) / 86400))
  [ "$left" -ge 1 ] ||
    fail "the authority $1/ca ends on $end: make a new one in another folder, and new certificates"
  if [ "$2" -gt "$left" ]; then
    echo "certificates.sh: $left days instead of $2: the authority itself ends on $end" >&2
    echo "$left"
  else
    echo "$2"
  fi
}

# make_certificate FOLDER NAME DAYS SAN: fills FOLDER/NAME.
make_certificate() {
  local folder=$1 common=$2 lifetime=$3 san=$4 usage=clientAuth work file
  [ -f "$folder/ca/ca.key" ] || fail "$folder/ca/ca.key is not there; make the authority first: ca"
  lifetime=$(days_left "$folder" "$lifetime")
  # a router is a client of other routers, too; a client may never stand in for a router
  [ -z "$san" ] || usage="serverAuth, clientAuth"
  work=$(mktemp -d "$folder/.new.XXXXXX")
  trap 'rm -rf "$work"' EXIT
  new_key "$work/tls.key"
  printf '%s\n' '[req]' 'distinguished_name = dn' 'prompt = no' '[dn]' "CN = $common" \
    '[ext]' 'basicConstraints = critical, CA:FALSE' 'keyUsage = critical, digitalSignature' \
    "extendedKeyUsage = $usage" 'subjectKeyIdentifier = hash' 'authorityKeyIdentifier = keyid' \
    "subjectAltName = ${san:-DNS:$common}" >"$work/new.cnf"
  openssl req -new -sha256 -key "$work/tls.key" -config "$work/new.cnf" -out "$work/new.csr"
  openssl x509 -req -sha256 -in "$work/new.csr" -CA "$folder/ca/ca.crt" -CAkey "$folder/ca/ca.key" \
    -set_serial "0x$(openssl rand -hex 16)" -extfile "$work/new.cnf" -extensions ext \
    -days "$lifetime" -out "$work/tls.crt" 2>"$work/said" || fail "$(cat "$work/said")"
  cp "$folder/ca/ca.crt" "$work/ca.crt"
  rm "$work/new.cnf" "$work/new.csr" "$work/said"
  if [ -e "$folder/$common" ]; then
    # one after the other: who starts in this very moment finds a pair that does not fit, and says so
    mv -f "$work/ca.crt" "$work/tls.crt" "$work/tls.key" "$folder/$common/"
    rm -rf "$work"
  else
    mv -T "$work" "$folder/$common"
  fi
  trap - EXIT
  echo "$folder/$common: a certificate for '$common', for $lifetime days"
}

fresh() {
  [ ! -e "$1/$2" ] || fail "$1/$2 exists already; a new one under the same name is made by: renew"
}

san_of() {
  openssl x509 -in "$1" -noout -ext subjectAltName | sed -n 's/IP Address/IP/g; 2s/[[:space:]]//gp'
}

list_certificates() {
  local file
  [ -d "$1" ] || fail "$1 is no folder that is there"
  [ -f "$1/ca/ca.crt" ] || fail "$1/ca/ca.crt is not there; make the authority first: ca"
  for file in "$1"/*/tls.crt "$1"/ca/ca.crt; do
    [ -f "$file" ] || continue
    printf '%-40s %s\n' "$(basename "$(dirname "$file")")" \
      "$(openssl x509 -in "$file" -noout -enddate | cut -d= -f2)"
  done
}

command -v openssl >/dev/null || fail "openssl is not installed"
[ $# -ge 2 ] || usage
action=$1
shift
options "$@"
folder=${words[0]:-}
[ -n "$folder" ] || usage
case $action in
  ca)
    [ ${#words[@]} -eq 1 ] || usage
    make_authority "$folder" "$days" "$name"
    ;;
  issue)
    [ ${#words[@]} -eq 2 ] || usage
    valid_name "${words[1]}"
    fresh "$folder" "${words[1]}"
    make_certificate "$folder" "${words[1]}" "${days:-90}" ''
    ;;
  router)
    [ ${#words[@]} -ge 3 ] || usage
    valid_name "${words[1]}"
    fresh "$folder" "${words[1]}"
    san=$(alternative_names "${words[@]:2}")
    make_certificate "$folder" "${words[1]}" "${days:-90}" "$san"
    ;;
  renew)
    [ ${#words[@]} -eq 2 ] || usage
    valid_name "${words[1]}"
    old=$folder/${words[1]}/tls.crt
    [ -f "$old" ] || fail "$old is not there; make it first: issue or router"
    san=''
    if openssl x509 -in "$old" -noout -ext extendedKeyUsage | grep -q 'Server Authentication'; then
      san=$(san_of "$old")
    fi
    make_certificate "$folder" "${words[1]}" "${days:-90}" "$san"
    ;;
  list)
    [ ${#words[@]} -eq 1 ] || usage
    list_certificates "$folder"
    ;;
  *) usage ;;
esac
