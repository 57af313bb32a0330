# shellcheck shell=bash
# Functions of the container tests, which docker/test starts with an engine and the images.

fail() {
  echo "$(basename "$0"): $1" >&2
  exit 1
}

# await WHAT SECONDS CMD…: until CMD succeeds.
await() {
  local what=$1 end=$((SECONDS + $2))
  shift 2
  until "$@"; do
    [ $SECONDS -lt $end ] || fail "not in time: $what"
    sleep 0.2
  done
}

# The id of the container of a compose service: container NAME. Not by docker-compose, which takes a second.
container() {
  docker ps --all --quiet --filter "label=com.docker.compose.project=$COMPOSE_PROJECT_NAME" \
    --filter "label=com.docker.compose.service=$1"
}

# said NAME TEXT: true if the service has printed it.
said() { docker logs "$(container "$1")" 2>&1 | grep -F "$2" >/dev/null; }

# in_container NAME CMD…: runs CMD in the container of a service.
in_container() {
  local name=$1
  shift
  docker exec "$(container "$name")" "$@"
}

healthy() { [ "$(docker inspect -f '{{.State.Health.Status}}' "$(container "$1")")" = healthy ]; }

# True if the service listens to the multicast group of DDS discovery, 239.255.0.1.
hears_multicast() { in_container "$1" grep -qi '^\s*0100FFEF' /proc/net/igmp; }

# The demo's programs have called the service and got correct answers.
expect_demo_answers() {
  await "the answer in channel 1" 60 said cnc "[ch1] response = 1.732051"
  await "the last answer in channel 2" 60 said cnc "[ch2] call 5: state 99"
  said cnc "[ch2] call 4: state 1, 1000.000000" || fail "channel 2 has another answer to its call 4"
}
