-- description: Where flows begin whose first publisher is not traced, a sentence for each topic
--     with which paths of a result (`noted`) begin so.
-- grain: one row per topic
SELECT
    format(
        'what publishes {} is not traced: flows begin with {}',
        topic_name,
        CASE is_stamped
            WHEN true THEN 'the stamp of each message'
            WHEN false THEN 'its take: its clock may be another one'
            ELSE 'the stamp of each message, or its take where its clock may be another one'
        END
    ) AS sentence
FROM untraced_begin
WHERE EXISTS (FROM noted WHERE starts_with(path, format('(not traced) → {} → ', topic_name)))
ORDER BY topic_name
