-- description: How often each word of a group occurs: a map from words to numbers, the most
--     frequent first. A group without words has NULL.
-- param: word VARCHAR  Words of a group; NULL does not count
CREATE OR REPLACE MACRO main.word_counts(word) AS
nullif(
    map_from_entries(
        list_transform(
            list_sort(list_transform(
                map_entries(histogram(word)),
                lambda entry: {'rest': -entry.value::BIGINT, 'word': entry.key}
            )),
            lambda entry: {'key': entry.word, 'value': -entry.rest}
        )
    ),
    MAP {}
)
