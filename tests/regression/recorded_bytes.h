#pragma once
#include <map>
#include <string>

// SHA-256 of what bytes_test.cpp writes, for each instruction set. Scene and fields were recorded at commit
// 07c747b, owners and all that is made with them where `embed` began to draw a code for each image. That of
// AVX-512 is not recorded: no machine that had it was at hand.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "16ff1d777e0e45a02bee45f3a2fd66644062ed763c77e0361b977d6966cc3a88"},
    {"code logits", "2f33211e2731a06e981fd50de867eba067a3a60bb7b14ca8f03202017a8ed72f"},
    {"code owner", "1ab6de378e9a1443a3820fd4d4df6a48214316ce69ebe88c1c59e0246e2f680a"},
    {"code renders", "a4d7c98a8f6dc83e6f9f494a86fb422eab1cad5c7c21ce0577cf3d9ae4e19304"},
    {"fast baked field", "0af13305165ad95de70a1988da54d13e66d906c04c0acc45c0b72edf1d661673"},
    {"fast logits", "5eaea1f4ef0aea4357df350fad15a9337156e21cbe38f5dc2175c5a34a41c48f"},
    {"fast owner", "94a698eb5b452832320ea3c6300a850b04e1fec3c9ce6816e4ea8959cd80e414"},
    {"fast renders", "a7f5e13b156882aa861bbc628a266ba7d4ffac397ed5c5d29418a3acb4416a5a"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "992bb227cc053f4613fb6033cc8024c5d7b0ee2e1c3391f860b521fd78adc12b"},
    {"paper logits", "2f33211e2731a06e981fd50de867eba067a3a60bb7b14ca8f03202017a8ed72f"},
    {"paper owner", "92e3e0a63332e197849796aa165a22556595dc385a653b7416b78508f11ae524"},
    {"paper renders", "95ca647ae3a1c83fa29f55af41e55fa966605aa00e4f0dba6d64f7382f3af16c"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "bae262e4f48faeb8c12ea11c314f16a2929ceaacb3947c93e722d392a890a655"},
    {"code logits", "2f33211e2731a06e981fd50de867eba067a3a60bb7b14ca8f03202017a8ed72f"},
    {"code owner", "534819f51af0b9c4997e26b7100fdb78c1645027a810372aa3016ed1fa6172f6"},
    {"code renders", "a7b616f20e99ee8e8bd5907b09890f0e6b25b3cfe5672b5c6a4576c000e4521b"},
    {"fast baked field", "363a5e138c537421e733537874065599ad77e76e15aa30e5136d1da2737648c2"},
    {"fast logits", "4e8d90dc689b688aba35ce70b6e5a4c8f193cd6389407222b6b8c86ef0d84a2c"},
    {"fast owner", "ff5daa82123846341d035c0cfdd1d2f80c8044d3c240a85cd4c8664d0c83ef31"},
    {"fast renders", "aee3b7628c42fdf152f738fec7a28d823cc50e59203ceb7815c6d29e6c9e9a60"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "598c6b21bb59d7b552587378c1b78157958e66da8ac45c286196572898b59f56"},
    {"paper logits", "2f33211e2731a06e981fd50de867eba067a3a60bb7b14ca8f03202017a8ed72f"},
    {"paper owner", "37a3d1c2d7f14f30eaddc915780dad53970f2036c23e58061aea529236bddce4"},
    {"paper renders", "2ee0f67d3253a0e5d5321b83c47eb70ad36a48bfc180e0ac85f20cbe4f30b246"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
