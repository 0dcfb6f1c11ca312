import pytest

from pipeline.sources.points_file import decompress_lzf


def test_literal_bytes_and_copies():  # R1, R2
    assert decompress_lzf(b"\x02abc", 3) == b"abc"
    assert decompress_lzf(b"\x02abc\x20\x02", 6) == b"abcabc"  # 3 bytes from 3 back
    assert decompress_lzf(b"\x00a\xe0\x02\x00", 12) == b"a" * 12  # 7 + 2 + 2 bytes from 1 back: it runs on into itself


@pytest.mark.parametrize("data", [b"", b"\x02ab", b"\x20", b"\x20\x05", b"\x00a\xe0", b"\x1f" + b"a" * 32])
def test_damaged_data_are_refused(data):
    with pytest.raises(ValueError, match="damaged"):
        decompress_lzf(data, 3)
