# Types into an interactive zsh that completes weft, with Tab where completion is asked for.
setopt err_exit
zmodload zsh/zpty
cd $(mktemp -d)
trap "rm -r $PWD" EXIT
touch drape.weft

zpty shell zsh -f -i
setup=(
  'PS1=; autoload -U compinit; compinit -D -u; source <(weft completion zsh)'
  'show() { print -r -- "LINE<$BUFFER>"; BUFFER=; zle accept-line }'
  'zle -N show; bindkey "^X" show'
  'print RE''ADY'
)
zpty -w shell "${(j:; :)setup}"
zpty -r shell out '*READY*'

failures=0
expect() {  # TYPED LINE
  zpty -w -n shell "$1"$'\t\x18'
  zpty -r shell out '*LINE<*>*'
  local line=${${out##*LINE<}%%>*}
  [[ $line == $2 ]] || { print -r -- "\"$1\" became \"$line\", not \"$2\""; failures=1 }
}
expect 'weft tex' 'weft textile '
expect 'weft session c' 'weft session create '
expect 'weft record drape --enc' 'weft record drape --encoding '
expect 'weft export drape.weft --format p' 'weft export drape.weft --format pc2 '
expect 'weft info dr' 'weft info drape.weft '  # files, where weft has nothing to say
zpty -d shell
exit $failures
