"""The notation of messages as text."""
import random
import unittest

import nido
from nido import text


class Text(unittest.TestCase):
    def test_values_come_back(self):
        values = [1, -2, 0.1, 1e-9, "two words", 'a "quote" \\ and\nmore', [1, [2.5, "x"], []], True, False, text.Word("ok")]
        back = text.parse(" ".join(text.dump(one) for one in values))
        self.assertEqual(back, values)
        self.assertIsInstance(back[-1], text.Word)
        self.assertIs(back[-2], False)

    def test_words_and_numbers(self):
        self.assertEqual(text.parse("[is] enc 65.0 [tsta] 0 12.5 [ok]"), ["is", "enc", 65.0, "tsta", 0, 12.5, "ok"])
        self.assertEqual(text.parse("0x10 -3 .5 1e3 {1 2 255} name_1"), [16, -3, 0.5, 1000.0, b"\x01\x02\xff", "name_1"])

    def test_a_dict_travels_as_pairs_and_comes_back(self):
        message = {"header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": ""}, "name": ["a", "b"], "objects": [{"x": 1}]}
        self.assertEqual(text.named(text.parse(text.dump(message))[0]), message)
        self.assertEqual(text.named([["name", []], ["on", [True, False]]]), {"name": [], "on": [True, False]})

    def test_what_is_malformed_is_refused(self):
        for line in ("(1 2", "[ok", '"text', "1)", "(" * 100):
            with self.assertRaises(nido.Error, msg=line):
                text.parse(line)
        for value in (float("nan"), float("inf"), None, object()):
            with self.assertRaises(nido.Error):
                text.dump(value)

    def test_any_line_gives_values_or_an_error(self):
        source = random.Random(1)
        for _ in range(20000):
            line = "".join(source.choice('()[]{}" \\ab1.-,e') for _ in range(source.randrange(30)))
            try:
                text.parse(line)
            except nido.Error:
                pass


if __name__ == "__main__":
    unittest.main()
