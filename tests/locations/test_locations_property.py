"""Any text is a path or a URL, and no password in a URL is shown."""

import pickle
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from livebode.locations import Url, location

WORDS = st.text("abcXYZ019-_.~%+", min_size=1, max_size=12)


@settings(max_examples=40, deadline=None)
@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0")))
def test_a_text_without_a_scheme_is_a_path(text: str) -> None:
    if "://" not in text:
        assert location(text) == Path(text)


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(["ftp", "sftp", "smb", "http", "HTTPS"]), WORDS, WORDS, WORDS, st.lists(WORDS, max_size=3))
def test_a_password_is_in_no_text_of_a_url_and_not_lost(
    scheme: str, user: str, password: str, host: str, parts: list[str]
) -> None:
    url = location("/".join([f"{scheme}://{user}:<{password}>@{host}", *parts]))
    assert isinstance(url, Url)
    assert f"<{password}>" not in f"{url} {url!r} {url.name}"
    assert f"<{password}>" in pickle.loads(pickle.dumps(url)).address
    assert str(url).endswith("/".join([host, *parts]))
    assert url == location(url.address)
