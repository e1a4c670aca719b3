#!/usr/bin/env bash
# Builds the image with docker and runs it as docker/compose.yaml does: read-only and without
# capabilities. It becomes healthy, ends with 0 within its grace time, and started again it has its session.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
image=weft-test name=weft-test-$$ grace=10  # s
hold="builds, healthy, not root, 0 within $grace s, the session is there"
command -v docker >/dev/null || { echo "image: no docker here, so it was not tried"; exit; }

said=$(mktemp)
trap 'docker rm --force --volumes $name >/dev/null 2>&1 || true; rm -f "$said"' EXIT
fail() { tail -n 40 "$said" >&2; echo "image: $1 (hold: $hold) SHORT"; exit 1; }
of() { docker inspect --format "$1" $name; }
inside() { docker exec $name weft "$@" >>"$said" 2>&1; }
since() { awk -v from="$1" -v to="$EPOCHREALTIME" 'BEGIN { printf "%.1f s", to - from }'; }
await_health() {
  for _ in {1..300}; do
    ! inside health || return 0
    sleep 0.1
  done
  docker logs $name >>"$said" 2>&1
  fail "not healthy after 30 s"
}

begun=$EPOCHREALTIME
docker build --tag $image --file docker/Dockerfile . >"$said" 2>&1 || fail "does not build"
built=$(since "$begun")

begun=$EPOCHREALTIME
docker run --detach --name $name --network none --read-only --cap-drop ALL --security-opt no-new-privileges \
  $image >"$said" 2>&1 || fail "does not start"
await_health
healthy=$(since "$begun")

inside scene new --template hang -o /var/lib/weft/scene.json &&
  inside session create /var/lib/weft/scene.json --id kept && inside run kept --until-frame 30 --wait ||
  fail "a session does not run"
begun=$EPOCHREALTIME
docker stop --time $grace $name >>"$said" 2>&1
stopped=$(since "$begun")
code=$(of '{{.State.ExitCode}}')
user=$(docker image inspect --format '{{.Config.User}}' $image)
size=$(docker image inspect --format '{{.Size}}' $image)
[ "$code" = 0 ] || fail "ends with $code"
[ -n "$user" ] && [ "$user" != root ] || fail "runs as root"

docker start $name >>"$said" 2>&1
await_health
inside session get kept && grep -q "^frame  *30$" "$said" || fail "its session is gone"
echo "image: built in $built, $((size / 1000000)) MB, healthy after $healthy, user $user, 0 after $stopped," \
  "its session there when started again (hold: $hold) ok"
