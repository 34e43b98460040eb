-- description: Whether flows follow a causal link. Without a declaration they do not if it has more
--     than one candidate: the message may have led to nothing, or be of another process. Indirect
--     links are as true as their declaration, and are followed.
CREATE OR REPLACE MACRO derive.is_followed(kind, candidate_count) AS
derive.is_indirect(kind) OR coalesce(candidate_count, 1) = 1
