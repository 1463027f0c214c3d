import re
from pathlib import Path

from grasping_invisible.data.topics import BY_KEY, TOPICS

LOGS = (Path(__file__).parents[2] / "docs" / "logs.md").read_text()


def test_every_key_names_one_topic() -> None:
    assert len(BY_KEY) == len(TOPICS)


def test_the_document_has_the_table_of_topics() -> None:
    rows = re.findall(r"^\| `(gi/\S+)` \| `(\S+)` \| (\w+) \| (.+?) \| (.+?) \|$", LOGS, re.MULTILINE)
    assert rows == [
        (topic.key, topic.message.DESCRIPTOR.full_name, topic.speaker.value, topic.rate, topic.about)
        for topic in TOPICS
        if topic.logged
    ]
