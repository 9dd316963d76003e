#!/bin/sh
# A renderer that does what its first argument says, instead of rendering.
# Usage: misbehaving.sh WORD SCENE OUTPUT
word=$1 output=$3 here=$(dirname "$0")

case $word in
exits-with-3) echo "reading the scene"; echo "no such mesh: teapot.ply" >&2; exit 3 ;;
exits-silently) exit 1 ;;
kills-itself) kill -SEGV $$ ;;
kills-its-group) kill -KILL 0 ;;
hangs) exec sleep 100 ;;
hangs-with-children)
    # Children and grandchildren that ignore every polite request.
    for child in 1 2; do
        sh -c 'trap "" TERM INT HUP; (trap "" TERM; echo $$ >>"$1/pids"; exec sleep 100) & echo $! >>"$1/pids"
               sleep 100; sleep 100' sh "$here" &
    done
    trap "" TERM; echo $$ >>"$here/pids"; wait ;;
leaves-a-child) sleep 100 & echo $! >>"$here/pids" ;;
leaves-a-daemon) setsid sleep 4 & sleep 0.2 ;;
writes-nothing) echo done ;;
writes-elsewhere) echo >"$(dirname "$output")/picture.pfm" ;;
writes-strange-names) : >"$(dirname "$output")/$(printf 'a\033[31m\nb')" ;;
writes-a-directory) mkdir "$output" ;;
writes-a-link) echo secret >"$here/secret"; ln -s "$here/secret" "$output" ;;
writes-a-dangling-link) ln -s /nowhere "$output" ;;
writes-a-pipe) mkfifo "$output" ;;
writes-an-empty-file) : >"$output" ;;
prints-endlessly) exec yes "$(printf '%01000d' 7)" ;;
prints-without-newline) tr '\0' x </dev/zero ;;
prints-a-lot) i=0; while [ $i -lt 3000 ]; do echo "sample $i"; i=$((i+1)); done; exit 1 ;;
prints-escapes)
    printf 'a\033[31mred\033[0m \033]0;title\007 \342\200\256gpj.exe \330\234 \377\376 \233 \000 \033c\n'
    printf 'progress 10 %%\rprogress 100 %%\r\nlast\t\302\205\342\200\250line\n'
    exit 1 ;;
prints-its-folders) echo "$PWD and $HOME and $here"; exit 1 ;;
shows-its-environment) env | sort >"$here/environment"; exit 1 ;;
reads-standard-input) read -r line; echo "got '$line'"; exit 1 ;;
closes-everything) exec <&- >&- 2>&-; sleep 0.2; exit 4 ;;
removes-its-folder) cd /; rm -rf "$(dirname "$output")" ;;
removes-its-home) cp "$here/right.pfm" "$output"; cd /; cp "$output" "$here/kept.pfm"; rm -rf "$HOME"
    mkdir -p "$(dirname "$output")"; cp "$here/kept.pfm" "$output" ;;
locks-its-folder) cp "$here/right.pfm" "$output"; chmod 0 "$HOME" ;;
digs-deep)
    cp "$here/right.pfm" "$output"
    mkdir -p "$HOME/$(printf '%01500d' 0 | sed 's|0|d/|g')" ;;
copies) cp "$here/image" "$output" ;;
*) echo "no such word: $word"; exit 64 ;;
esac
