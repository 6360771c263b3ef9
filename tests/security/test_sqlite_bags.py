"""SQLite bags whose schema works: views that never end, virtual tables, generated columns, triggers, columns of other kinds."""

import sqlite3
import sys

import pytest

from tests.security.measured import measured

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of a process are measured on Linux")
TOPICS = ("create table topics (id integer primary key, name text, type text, serialization_format text);"
          "insert into topics values (1, '/x', 'std_msgs/msg/Float64', 'cdr');")
MESSAGES = "create table messages (id integer primary key, topic_id integer, timestamp integer, data blob);"
ENDLESS = "with recursive n(i) as (select 1 union all select i + 1 from n) select i as id, 1 as topic_id, i as timestamp, x'00' as data from n"
SCHEMAS = {
    "endless view of messages": TOPICS + f"create view messages as {ENDLESS};",
    "endless view of topics": MESSAGES + "create view topics as with recursive n(i) as (select 1 union all select i + 1 from n) "
                                         "select i as id, 'a' as name, 'b' as type, 'cdr' as serialization_format from n;",
    "large view": TOPICS + "create view messages as select 1 as id, 1 as topic_id, 1 as timestamp, zeroblob(900000000) as data;",
    "generated column": TOPICS + "create table messages (id integer primary key, topic_id integer, timestamp integer, "
                                 "data blob generated always as (zeroblob(900000000)) virtual); insert into messages values (1, 1, 1);",
    "virtual table": TOPICS + "create virtual table messages using fts5(id, topic_id, timestamp, data);",
    "texts as numbers": TOPICS + "create table messages (id text, topic_id text, timestamp text, data text);"
                                 "insert into messages values ('a', 'b', 'c', 'd');",
    "nulls": TOPICS + "create table messages (id integer, topic_id integer, timestamp integer, data blob); insert into messages values (null, null, null, null);",
    "large numbers": "create table topics (id text, name text, type text, serialization_format text);"
                     "insert into topics values ('x', '/x', 'std_msgs/msg/Float64', 'cdr');" + MESSAGES,
    "no tables": "create table other (a);",
}


@pytest.mark.parametrize("kind", SCHEMAS)
def test_a_schema_that_works(tmp_path, kind):
    database = sqlite3.connect(tmp_path / "x.db3")
    try:
        database.executescript(SCHEMAS[kind])
    except sqlite3.OperationalError as error:
        pytest.skip(str(error))  # this SQLite has no such thing
    database.close()
    found = measured("from flight_graph.bags.reader import read_bag", "read_bag(sys.argv[1])", tmp_path / "x.db3")
    assert "not a sound bag of rosbag2" in found.sentence and found.cpu_s < 1.0 and found.grown < 200.0, found
