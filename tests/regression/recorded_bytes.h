#pragma once
#include <map>
#include <string>

// SHA-256 of the files of bytes_test.cpp, for each instruction set. Scene and fields were recorded at commit
// 07c747b; all else anew with each change that was meant to change it: owners at last where Muon takes its
// steps on the smaller square product, logits of preset fast where informed detection counts the extractor's
// evidence, all that is made of marks once more where a smaller field was marked, and of preset fast where
// cells are dealt by strength and where mixed colours went further to grey. AVX-512 is not recorded.
inline const std::map<std::string, std::string> kBytesV2{
    {"code baked field", "2bb5dca22d53da45d542e46475df69e31d93a55d81e1d9f5b0d2f29276563e20"},
    {"code logits", "b25716cdfd082a55732ccd5257bc7a450e3c0487069ffcaa707cad5b40ee98e6"},
    {"code owner", "84682588fe51aec6fc3a19d855acef0c7e33611cfbc1087cb1dff82b54b2518e"},
    {"code renders", "117728ccf70376a6b06b55ebc1938d3615b011b5b2eb6f029a693f8356ef2dca"},
    {"fast baked field", "adf16ff787b5252cdf22c1a91c5e8a8d639ceb5786d0ea2e98ddb797cf72669d"},
    {"fast logits", "ff63e1921212a9902ca6a6565dd9ba3eb7ac48a96fe56f4dffbf44900a4c2b85"},
    {"fast owner", "23c5e7bc5b1e7f7ad5edeea7d7564ee77921dcb3c0785a742cf599ae913f5f07"},
    {"fast renders", "f50dcbc0c05c9b22a9da77491da399afc572330ed4f69c544d27406667c419f4"},
    {"hash field", "7169f1e7a7340da7cd7253b251b0cd4a79ddbae0180376de07068fb54e49625e"},
    {"hash renders", "baa40da4b96dabbc50683172ea5a025558fec184ce9d31f9a64788f2d3e3cf81"},
    {"marked field", "24802a52122f8300a525fa8a68d38c9a6511cd34fe6631e04e41d855d65029ca"},
    {"mlp field", "7b33409f716c7056416cecc68cb45c617c9aca7da414de414f01d9eeff7cdb82"},
    {"paper baked field", "c5228e378f09eba8bc5dfe71bf1857fa311ea2da240b1134daa74d8e232ee341"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "76b66ef8cc8b73d8635e16f16d195c01e0f174e8eb51e962950c0b2aa8093f0c"},
    {"paper renders", "46e72a0d33bc6a6e034bb1dc2575c66e4e03bbaa059116e6f72670ef79a0ed71"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
inline const std::map<std::string, std::string> kBytesV3{
    {"code baked field", "2754f035a38548249dd92304d30287785f732380db40a9055b74cec9afee9af6"},
    {"code logits", "b25716cdfd082a55732ccd5257bc7a450e3c0487069ffcaa707cad5b40ee98e6"},
    {"code owner", "c0b94233bbff296932cd6b27ff3a6829d6b5b6fecea1f75fd41737f19603a77d"},
    {"code renders", "46a156ec5c69795483579e78ba8892f5ac74a6f1a84e95d72a4c701c338fa6dd"},
    {"fast baked field", "61bdeb7b7287a35fd781e07e745f23aa407a238670457cd387d75cf361ccbf05"},
    {"fast logits", "d3afb337d281c125a294a1a94244f172054437d5ec4bcb9cb8b415698b6d00ba"},
    {"fast owner", "971ca8fefe6f31d698e9c2dea429e7024a4b41ab76c04bc031da75807ce6c96d"},
    {"fast renders", "279539f5fdb2ae433d82fa4116d136389d4d16660870c083926c93f304fab759"},
    {"hash field", "ddb8c16b2d62994a59ed8aa4ae932d923e75564baf99a3cbcda6591352018d07"},
    {"hash renders", "763dad960bc961b320a62d8cb39600e608c8bfd38de9fa6e679e5a4ad810aab6"},
    {"marked field", "d2cb46c136ca754ddbc07f92cb65a0a5de60b6393aa06b772094ad3f82ec807c"},
    {"mlp field", "75b9aa11ccbf62dada9278d143ad378beee4521b95c4db7fe9702982666dee32"},
    {"paper baked field", "13c3f317fb39c167640e8a9fbff7793d01da904c2b32c60a347f864ea1eea904"},
    {"paper logits", "56e424adb296950876ab8f3e014143aa29f7599de504457f2c42197769474182"},
    {"paper owner", "2d5a24445d80dc740d8953900742c005bf3e54a10d840e5bdca7d15038ea076f"},
    {"paper renders", "206c3ece7301865d5868b1177c48db288647cad92fc575e1651ed5e448f73e80"},
    {"scene", "15bf0def4f0aafd36af902743d49e9f0b84f3c33f7f1a5522020bce02dc28ac2"}};
