-- title: What became of the messages of a bag, by topic
-- description: How many messages of a bag were joined to their publication, and why others were
--     not.
-- grain: one row per topic of the bag
-- reads: bag_joined
-- column: topic_name VARCHAR [topic]  Name of the topic
-- column: messages BIGINT  Messages in the bag
-- column: joined BIGINT  Those whose publication is known
-- column: ambiguous BIGINT  Those that may be of several publications, or whose publication may
--     have another message
-- column: no_publication BIGINT  Those whose publication the trace does not have
-- column: topic_not_published BIGINT  Those of topics without a publication in the run
-- column: bound_ns BIGINT [ns]  How long after it was sent a message may be received
SELECT
    topic_name,
    count(*) AS messages,
    count(publication_id) AS joined,
    count(*) FILTER (reason = 'ambiguous') AS ambiguous,
    count(*) FILTER (reason = 'no_publication') AS no_publication,
    count(*) FILTER (reason = 'topic_not_published') AS topic_not_published,
    any_value(bound_ns) AS bound_ns
FROM bag_joined
GROUP BY topic_name
ORDER BY topic_name
