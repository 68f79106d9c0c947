#pragma once

#include <string>
#include <vector>

namespace nido {

// voices: an accent and a variant of it. None of the variants f1, f2, m2, m4, m7 and not the accent
// en-gb-x-rp: they are the experiment's.
inline const std::vector<std::string> kAccents = {
    "en-us",          "en-us",          "en-us",          "en-gb",  "en-gb",
    "en-gb-scotland", "en-gb-x-gbclan", "en-gb-x-gbcwmd", "en-029", "en-us-nyc"};
inline const std::vector<std::string> kVariants = {
    "",         "f3",      "f4",      "f5",     "m1",     "m3",         "m5",      "m6",      "m8",
    "adam",     "Alex",    "Alicia",  "Andrea", "Andy",   "anika",      "Annie",   "antonio", "belinda",
    "benjamin", "boris",   "caleb",   "david",  "ed",     "edward",     "edward2", "Gene",    "gustave",
    "Henrique", "Hugo",    "iven",    "Jacky",  "john",   "kaukovalta", "klatt",   "klatt3",  "klatt4",
    "Lee",      "linda",   "marcelo", "Marco",  "Mario",  "max",        "Michael", "michel",  "miguel",
    "Mike",     "norbert", "pablo",   "paul",   "pedro",  "quincy",     "rob",     "robert",  "sandro",
    "shelby",   "steph",   "steph2",  "travis", "victor", "zac"};

}  // namespace nido
