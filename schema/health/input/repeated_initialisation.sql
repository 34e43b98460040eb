-- title: Objects that were initialised again
-- description: A publisher or subscription got the handle of an earlier one of the same topic.
--     The later one counts from then on. Not counted: publishers of /rosout, all of
--     which rcl initialises at one address.
-- cause: The object was destroyed and created again, or its creation was traced twice.
-- cure: None needed.
-- grain: one row, if there are any
-- severity: info
WITH initialised AS (
    SELECT
        process_id,
        publisher_handle AS handle,
        topic_name,
        lag(topic_name) OVER (
            PARTITION BY process_id, publisher_handle ORDER BY event_id
        ) AS previous_topic
    FROM staging.publisher_known
    UNION ALL
    SELECT
        process_id, subscription_handle, topic_name,
        lag(topic_name) OVER (PARTITION BY process_id, subscription_handle ORDER BY event_id)
    FROM staging.subscription_known
)
SELECT
    count(*) AS count,
    'publishers and subscriptions initialised on the handle of another one of the same topic: '
    || 'created again, or traced twice; the later one counts from then on: '
    || string_agg(DISTINCT topic_name, ', ' ORDER BY topic_name) AS detail
FROM initialised
WHERE topic_name = previous_topic AND topic_name <> '/rosout'
HAVING count(*) > 0
