#!/bin/sh
# Adapts the acoustic model en-us to synthetic voices and noise: config/speech_model holds what differs from Debian's.
# Needs sphinxtrain, sphinxbase-utils, pocketsphinx, espeak-ng, and the program nido-speech-lessons:
#
#     ninja -C build nido-speech-lessons && nodes/speech/training/adapt.sh build/bin/nido-speech-lessons /tmp/adapt
set -eu
lessons=$1
work=$2
count=${3:-4000}
passes=${4:-2}
here=$(dirname "$(realpath "$0")")
config=$here/../../../config
model=/usr/share/pocketsphinx/model/en-us/en-us
tools=/usr/lib/sphinxtrain

mkdir -p "$work/model"
cd "$work"
[ -s lessons/lessons.fileids ] || "$lessons" --phrases "$config/phrases.yaml" --out lessons --count "$count"
sphinx_fe -argfile "$model/feat.params" -samprate 16000 -c lessons/lessons.fileids -di lessons -do lessons -ei raw -eo mfc \
  -raw yes >fe.log 2>&1

# the model as sphinxtrain reads it
pocketsphinx_mdef_convert -text "$model/mdef" mdef.txt >mdef.log 2>&1
python3 "$here/mixture_weights.py" "$model/sendump" model/mixture_weights
cp "$model/means" "$model/variances" "$model/transition_matrices" "$model/noisedict" model

pass=1
while [ "$pass" -le "$passes" ]; do
  mkdir -p "counts$pass" "model$pass"
  "$tools/bw" -hmmdir model -moddeffn mdef.txt -meanfn model/means -varfn model/variances -mixwfn model/mixture_weights \
    -tmatfn model/transition_matrices -ts2cbfn .ptm. -feat 1s_c_d_dd -svspec 0-12/13-25/26-38 -cmn batch -agc none \
    -dictfn lessons/lessons.dict -fdictfn "$model/noisedict" -ctlfn lessons/lessons.fileids -cepdir lessons \
    -lsnfn lessons/lessons.transcription -accumdir "counts$pass" -tmatreest no >"bw$pass.log" 2>&1
  "$tools/map_adapt" -moddeffn mdef.txt -ts2cbfn .ptm. -meanfn model/means -varfn model/variances \
    -mixwfn model/mixture_weights -accumdir "counts$pass" \
    -mapmeanfn "model$pass/means" -mapvarfn "model$pass/variances" -mapmixwfn "model$pass/mixture_weights" \
    >"map$pass.log" 2>&1
  cp "model$pass/means" "model$pass/variances" "model$pass/mixture_weights" model
  pass=$((pass + 1))
done
"$tools/mk_s2sendump" -pocketsphinx yes -moddeffn mdef.txt -mixwfn model/mixture_weights -sendumpfn model/sendump \
  >sendump.log 2>&1
