-- description: How often each word of a group occurs, as a text: 'a 3, b 1'. The most frequent word
--     comes first. A group without words has NULL.
-- param: word VARCHAR  Words of a group; NULL does not count
CREATE OR REPLACE MACRO main.counts_text(word) AS
nullif(array_to_string(
    list_transform(
        list_sort(list_transform(
            map_entries(histogram(word)),
            lambda entry: {'rest': -entry.value::BIGINT, 'word': entry.key}
        )),
        lambda entry: entry.word || ' ' || -entry.rest
    ),
    ', '
), '')
