# bash completion for nido: source this file.
_nido() {
  local word=${COMP_WORDS[COMP_CWORD]} nido=${COMP_WORDS[0]} verb=${COMP_WORDS[1]:-} choices=""
  # port names hold colons, which readline takes for the end of a word
  COMP_WORDBREAKS=${COMP_WORDBREAKS//:/}
  if [ "$COMP_CWORD" -eq 1 ]; then
    choices="launch port node world experiment bench doctor --help --version"
  elif [[ $word == -* ]]; then
    choices=$("$nido" "${COMP_WORDS[@]:1:COMP_CWORD-1}" --help 2>/dev/null | grep -o -- '--[a-z]*' | sort -u)
  else
    case $verb in
      launch) choices=$("$nido" launch '?' 2>&1 | sed -n 's/.*there are: //p' | tr -d ',') ;;
      port)
        if [ "$COMP_CWORD" -eq 2 ]; then
          choices="list info read write rpc connect disconnect hz bw delay ping"
        else
          choices=$(timeout 3 "$nido" port list 2>/dev/null | cut -d' ' -f1)
        fi
        ;;
      node)
        if [ "$COMP_CWORD" -eq 2 ]; then choices="list info"; else choices=$(timeout 3 "$nido" node list 2>/dev/null | cut -d' ' -f1); fi
        ;;
      experiment)
        if [ "$COMP_CWORD" -eq 2 ]; then choices="list run"; else choices=$("$nido" experiment list 2>/dev/null | cut -d' ' -f1); fi
        ;;
    esac
  fi
  mapfile -t COMPREPLY < <(compgen -W "$choices" -- "$word")
}
complete -o default -F _nido nido
