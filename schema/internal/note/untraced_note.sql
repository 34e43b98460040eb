-- description: A sentence for each topic at the begin of a path of a result (`noted`) whose
--     publisher is not traced: where its flows begin.
-- grain: one row per topic
-- reads: noted
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
